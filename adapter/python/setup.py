"""pip install: CMake builds the extension module from this source tree; setuptools packs it."""

import os
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        source = Path(__file__).resolve().parents[2]
        work = Path(self.build_temp).resolve()
        target = Path(self.get_ext_fullpath(extension.name)).resolve()
        subprocess.check_call([
            "cmake", "-S", source, "-B", work, "-DCMAKE_BUILD_TYPE=Release",
            "-DIPMINMAX_BUILD_TESTS=OFF", "-DIPMINMAX_BUILD_EXAMPLES=OFF",
            "-DIPMINMAX_BUILD_CASADI=OFF", f"-DPython3_EXECUTABLE={sys.executable}"])
        subprocess.check_call(["cmake", "--build", work, "--target", "ipminmax_python", "-j",
                               str(os.cpu_count())])
        built = list((work / "python" / "ipminmax").glob("_core.*"))
        if len(built) != 1:
            raise RuntimeError("NumPy, Python's headers or pybind11 was not found by CMake")
        target.parent.mkdir(parents=True, exist_ok=True)
        self.copy_file(str(built[0]), str(target))


setup(ext_modules=[Extension("ipminmax._core", [])], cmdclass={"build_ext": CMakeBuild})
