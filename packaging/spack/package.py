# Not built here (no Spack). As packages/py_hpcdem/package.py of a repository of your own, then in the sources:
#   spack dev-build py-hpcdem@0.2.0
from spack.package import *


class PyHpcdem(PythonPackage):
    """Parallel discrete-element modelling of geological structures."""

    version("0.2.0")

    depends_on("python@3.11:", type=("build", "run"))
    depends_on("py-setuptools@64:", type="build")
    depends_on("py-numpy@1.24:", type=("build", "run"))
    depends_on("py-numba@0.59:", type=("build", "run"))
    depends_on("py-scipy@1.10:", type=("build", "run"))
    depends_on("py-mpi4py@3.1:", type=("build", "run"))
    depends_on("py-h5py@3.7:", type=("build", "run"))
    depends_on("py-matplotlib@3.6:", type=("build", "run"))
    depends_on("py-click@8.0:", type=("build", "run"))
    depends_on("py-rich@13.0:", type=("build", "run"))
    depends_on("py-packaging@21.0:", type=("build", "run"))
    depends_on("py-pydantic@2.5:", type=("build", "run"))
    depends_on("py-filelock@3.9:", type=("build", "run"))
