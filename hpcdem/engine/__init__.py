"""What models of any physics share: the step, rebuilds of lists, storage and energy budgets."""
