# Copyright The Fissure developers.
#
# SPDX-License-Identifier: (MIT OR Apache-2.0)

import os

from spack.package import *


class Fissure(Package):
    """Peridynamics for batch jobs: cracks that start, run and branch by themselves."""

    # In the folder of the repository:
    #
    #   spack repo add packaging/spack
    #   spack install fissure
    #
    # builds the branch `main` with the MPI of Spack.
    homepage = "file://" + os.path.realpath(os.path.join(os.path.dirname(__file__), "../../../.."))
    git = homepage

    license("MIT OR Apache-2.0")

    version("0.2.0", branch="main")

    depends_on("c", type="build")
    depends_on("rust@1.95:", type="build")
    depends_on("llvm +clang", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mpi")
    depends_on("hdf5@1.10: +mpi +shared")

    def setup_build_environment(self, env):
        env.set("HDF5_DIR", self.spec["hdf5"].prefix)
        env.set("MPICC", self.spec["mpi"].mpicc)
        env.set("LIBCLANG_PATH", self.spec["llvm"].prefix.lib)

    def install(self, spec, prefix):
        cargo = which("cargo")
        cargo("install", "--locked", "--path", ".", "--root", prefix)
        fissure = Executable(prefix.bin.fissure)
        fissure("man", prefix.share.man.man1)
        completions = prefix.share.join("bash-completion").completions
        mkdirp(completions)
        with open(completions.fissure, "w") as file:
            file.write(fissure("completions", "bash", output=str))

    def test_version(self):
        """The command starts and names its MPI."""
        output = Executable(self.prefix.bin.fissure)("--version", output=str)
        assert f"fissure {self.spec.version}" in output
