"""Verdicts, plans and findings, rendered for people and for programs. Nothing here prints."""
