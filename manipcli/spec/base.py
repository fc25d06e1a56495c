"""The base of everything that users write: frozen, unknown keys forbidden, no NaN or infinity."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Model(BaseModel):
    """A block of a user's file."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
