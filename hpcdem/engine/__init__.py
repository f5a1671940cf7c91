"""Common base of models of any physics: the step, rebuilds of lists, storage and energy budgets."""
