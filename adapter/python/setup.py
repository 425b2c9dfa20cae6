"""pip install: CMake builds the extension module from the C++ sources; setuptools packs it.

The sources are those of the repository, or of the folder cpp that a source distribution carries. The shared libraries
that the module needs go into the package where patchelf is found, so that a wheel runs where they are not installed;
IPMINMAX_BUNDLE=0 leaves them out. CMAKE_ARGS are more arguments of CMake.
"""

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.sdist import sdist

HERE = Path(__file__).resolve().parent
SOURCE = HERE / "cpp" if (HERE / "cpp" / "CMakeLists.txt").exists() else HERE.parents[1]

#: Libraries of every Linux, by the beginning of their names.
SYSTEM = tuple("linux-vdso ld-linux libc.so libm.so libdl.so libpthread.so librt.so libresolv.so libutil.so "
               "libstdc++.so libgcc_s.so".split())


class SourceDistribution(sdist):
    """The package and, in cpp, the C++ sources."""

    FOLDERS = ("core", "linalg", "adapter", "cmake")
    KINDS = {".cpp", ".hpp", ".h", ".c", ".txt", ".cmake", ".in", ".map", ".py", ".pyi", ".typed"}

    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        names = [SOURCE / "CMakeLists.txt", SOURCE / "LICENSE"]
        for folder in self.FOLDERS:
            names += [path for path in (SOURCE / folder).rglob("*") if path.suffix in self.KINDS]
        for path in names:
            inside = path.relative_to(SOURCE)
            if path.is_file() and not {"build", "dist", "cpp", "__pycache__"} & set(inside.parts):
                target = Path(base_dir) / "cpp" / inside
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)


def needed_libraries(binary):
    """Names and files of the shared libraries that a binary loads, those of every Linux left out."""
    found = {}
    for line in subprocess.check_output(["ldd", str(binary)], text=True).splitlines():
        match = re.match(r"\s*(\S+) => (/\S+)", line)
        if match and not match.group(1).startswith(SYSTEM):
            found[match.group(1)] = Path(match.group(2)).resolve()
    return found


def patch(binary, names, folder):
    """Lets a binary load libraries by their new names from a folder. One change a call: patchelf 0.14
    loses some of several."""
    needed = subprocess.check_output(["patchelf", "--print-needed", str(binary)], text=True).split()
    for old in set(needed) & set(names):
        subprocess.check_call(["patchelf", "--replace-needed", old, names[old], str(binary)])
    subprocess.check_call(["patchelf", "--set-rpath", folder, str(binary)])


def bundle(module):
    """Copies them beside the module, under names of their own, which nothing else has loaded."""
    libraries = needed_libraries(module)
    folder = module.parent / "_libs"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    names = {}
    for name, path in libraries.items():
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
        stem, _, version = name.partition(".so")
        names[name] = f"{stem}-{digest}.so{version}"
        shutil.copyfile(path, folder / names[name])
    for new in names.values():
        patch(folder / new, names, "$ORIGIN")
        subprocess.check_call(["patchelf", "--set-soname", new, str(folder / new)])
    patch(module, names, "$ORIGIN/_libs")
    print(f"{len(names)} shared libraries are in the package: {', '.join(sorted(names))}")


def place(module, target):
    """The module with its libraries where the package is put together."""
    target.parent.mkdir(parents=True, exist_ok=True)
    # Anew: distutils keeps a newer target, and one that was patched does not survive another strip.
    shutil.copy(module, target)
    if os.environ.get("IPMINMAX_BUNDLE", "1") == "0":
        return
    if not (shutil.which("patchelf") and shutil.which("ldd")):
        print("patchelf is not found: the package needs the system's shared libraries")
        return
    subprocess.check_call(["strip", "--strip-unneeded", str(target)])
    bundle(target)


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        work = Path(self.build_temp).resolve()
        target = Path(self.get_ext_fullpath(extension.name)).resolve()
        arguments = ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG",
                     "-DIPMINMAX_BUILD_TESTS=OFF", "-DIPMINMAX_BUILD_EXAMPLES=OFF", "-DIPMINMAX_BUILD_CASADI=OFF",
                     "-DIPMINMAX_MPI=OFF", "-DIPMINMAX_PRECOMPILE=ON", f"-DPython3_EXECUTABLE={sys.executable}"]
        try:
            import pybind11
            arguments.append(f"-Dpybind11_DIR={pybind11.get_cmake_dir()}")
        except ImportError:  # CMake looks where the system has it
            pass
        arguments += shlex.split(os.environ.get("CMAKE_ARGS", ""))
        if shutil.which("ninja"):
            arguments.append("-GNinja")
        subprocess.check_call(["cmake", "-S", SOURCE, "-B", work, *arguments])
        subprocess.check_call(["cmake", "--build", work, "--target", "ipminmax_python", "-j", str(os.cpu_count())])
        built = list((work / "python" / "ipminmax").glob("_core.*.so"))
        if len(built) != 1:
            raise RuntimeError("NumPy, Python's headers or pybind11 was not found by CMake")
        place(built[0], target)


def missing_tools():
    """Packages with what is not installed; pip fetches them."""
    missing = [tool for tool in ("cmake", "ninja", "patchelf") if not shutil.which(tool)]
    try:
        import pybind11  # noqa: F401
    except ImportError:
        headers = [Path(prefix) / "include" / "pybind11" for prefix in ("/usr", "/usr/local")]
        if not any(folder.is_dir() for folder in headers):
            missing.append("pybind11>=2.10")
    return missing


if __name__ == "__main__":
    # A source distribution alone is packed, not built.
    setup(setup_requires=[] if "sdist" in sys.argv else missing_tools(),
          ext_modules=[Extension("ipminmax._core", [])],
          cmdclass={"build_ext": CMakeBuild, "sdist": SourceDistribution})
