"""The commands of ZDEM, one function each."""
