"""spack repo add packaging/spack; spack dev-build ipminmax@develop in a checkout."""

from spack.package import *


class Ipminmax(CMakePackage):
    """Interior-point solver for constrained nonconvex-nonconcave minmax problems."""

    license("BSD-3-Clause")

    version("develop")

    variant("shared", default=True, description="Install the shared library")
    variant("python", default=False, description="Python package")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.22:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("ipopt")
    depends_on("mumps+double~mpi")  # linear_solver mumps_mpi needs the parallel one beside it, which Spack has not
    depends_on("metis")
    depends_on("eigen@3.4:")
    depends_on("lapack")
    depends_on("python", when="+python", type=("build", "run"))
    depends_on("py-numpy", when="+python", type=("build", "run"))
    depends_on("py-pybind11", when="+python", type="build")
    conflicts("%gcc@:11", msg="C++20")

    def cmake_args(self):
        return [
            self.define_from_variant("BUILD_SHARED_LIBS", "shared"),
            self.define("IPMINMAX_BUILD_TESTS", False),
            self.define("IPMINMAX_BUILD_EXAMPLES", False),
            self.define("IPMINMAX_BUILD_CASADI", False),
            self.define("IPMINMAX_BUILD_AMPL", False),
            self.define("IPMINMAX_MPI", "OFF"),
            self.define_from_variant("IPMINMAX_BUILD_PYTHON", "python"),
            self.define("IPOPT_ROOT", self.spec["ipopt"].prefix),
            self.define("MUMPS_ROOT", self.spec["mumps"].prefix),
        ]
