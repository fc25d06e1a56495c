"""Renderers of verdicts, plans, logs and findings as text, JSON, HTML, JUnit and SARIF. Nothing here prints."""
