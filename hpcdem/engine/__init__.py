"""What every model has, whatever its physics: the step, when lists are rebuilt, storage, accounts of energy."""
