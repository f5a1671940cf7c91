-- Lmod: <modules>/hpcdem/0.2.0.lua, for an environment made by: python -m venv PREFIX; PREFIX/bin/pip install .
-- HPCDEM_PREFIX names PREFIX; load the MPI that mpi4py was built with.
local prefix = os.getenv("HPCDEM_PREFIX") or pathJoin(os.getenv("HOME"), "hpcdem", ".venv")
whatis("Name: hpcdem")
whatis("Version: 0.2.0")
whatis("Description: parallel discrete-element modelling of geological structures")
prepend_path("PATH", pathJoin(prefix, "bin"))
setenv("HPCDEM_BIN", pathJoin(prefix, "bin"))
setenv("HDF5_USE_FILE_LOCKING", "FALSE")
