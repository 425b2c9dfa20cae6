"""What pip installs: a source distribution that builds, and a module that brings its libraries."""

import os
import runpy
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("IPMINMAX_SOURCE_DIR", Path(__file__).parents[2])).resolve()
PACKAGE = SOURCE / "adapter/python"


def setup():
    """Names of setup.py; nothing is set up."""
    return runpy.run_path(str(PACKAGE / "setup.py"))


@unittest.skipUnless(shutil.which("patchelf") and shutil.which("ldd"), "patchelf is not installed")
class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        import ipminmax
        cls.folder = tempfile.TemporaryDirectory()
        cls.target = Path(cls.folder.name) / "ipminmax" / Path(ipminmax._core.__file__).name
        for _ in range(2):  # a second build into the same folder has once left a module that did not load
            setup()["place"](ipminmax._core.__file__, cls.target)
        for path in PACKAGE.glob("ipminmax/*.py"):
            shutil.copy(path, cls.target.parent)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_solves_with_its_own_libraries(self):
        program = ("from ipminmax import minimize_minmax\n"
                   "r = minimize_minmax(lambda x, y: x @ x - y @ y + x @ y, [1.0], [0.5])\n"
                   "print(r.certificate.kind)\n"
                   "print(*{line.split()[-1] for line in open('/proc/self/maps') if '.so' in line})\n")
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                             env={**os.environ, "PYTHONPATH": self.folder.name})
        self.assertEqual(run.returncode, 0, run.stderr)
        kind, loaded = run.stdout.splitlines()
        self.assertEqual(kind, "LOCAL_MINMAX")
        ours = [name for name in loaded.split() if name.startswith(self.folder.name)]
        self.assertTrue(any("libipopt" in name for name in ours), loaded)
        self.assertFalse([name for name in loaded.split() if name not in ours and "libipopt" in name])

    def test_needs_nothing_but_its_own_libraries_and_those_of_every_linux(self):
        system = setup()["SYSTEM"]
        own = {path.name for path in (self.target.parent / "_libs").iterdir()}
        for binary in [self.target, *(self.target.parent / "_libs").iterdir()]:
            needed = subprocess.check_output(["patchelf", "--print-needed", binary], text=True).split()
            for name in needed:
                self.assertTrue(name in own or name.startswith(system), f"{binary.name} needs {name}")


class SourceDistribution(unittest.TestCase):
    PARTS = ("core", "linalg", "adapter", "cmake")

    def sources(self, root):
        """Files that a compiler or CMake reads."""
        return {str(path.relative_to(root)) for part in self.PARTS for path in (root / part).rglob("*")
                if path.suffix in {".cpp", ".hpp", ".h", ".c", ".in", ".cmake", ".map"} or path.name == "CMakeLists.txt"}

    def test_builds_without_the_repository(self):
        with tempfile.TemporaryDirectory() as name:
            tree, build = Path(name) / "tree", Path(name) / "build"
            for part in self.PARTS:
                shutil.copytree(SOURCE / part, tree / part,
                                ignore=shutil.ignore_patterns("dist", "build", "*.egg-info", "__pycache__"))
            for file in "CMakeLists.txt", "LICENSE":
                shutil.copy(SOURCE / file, tree)
            subprocess.run([sys.executable, "setup.py", "-q", "sdist", "-d", name], check=True, capture_output=True,
                           cwd=tree / "adapter/python")
            archive, = Path(name).glob("ipminmax-*.tar.gz")
            shutil.unpack_archive(archive, name)
            packed, = Path(name).glob("ipminmax-*/")
            self.assertEqual(self.sources(packed / "cpp"), self.sources(tree))
            self.assertTrue((packed / "ipminmax/py.typed").exists())
            configured = subprocess.run(
                ["cmake", "-S", packed / "cpp", "-B", build, "-DIPMINMAX_BUILD_TESTS=OFF", "-DIPMINMAX_BUILD_EXAMPLES=OFF",
                 "-DIPMINMAX_BUILD_CASADI=OFF", "-DIPMINMAX_MPI=OFF", f"-DPython3_EXECUTABLE={sys.executable}"],
                capture_output=True, text=True)
            self.assertEqual(configured.returncode, 0, configured.stderr)
            self.assertIn("Python package: for", configured.stdout)


if __name__ == "__main__":
    unittest.main()
