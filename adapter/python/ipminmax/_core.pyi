"""The extension module, of core.cpp and formulas.cpp."""

from typing import Any

__version__: str

def __getattr__(name: str) -> Any: ...
