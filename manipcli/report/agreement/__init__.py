"""Results of several runs of one task, compared: text, JSON and the causes of a disagreement."""
