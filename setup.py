"""What pyproject.toml cannot say: packages from two folders, and the kernels that are compiled."""

import runpy

from setuptools import find_packages, setup

BUILD = "runtime/build_kernels.py"
build = runpy.run_path(BUILD)
if build["has_python_headers"]():
    kernels = {"cffi_modules": [f"{BUILD}:{name}_kernels" for name in ("double", "float", "long_double")]}
else:
    kernels = {"ext_modules": build["shared_libraries"]()}

setup(packages=[*find_packages("runtime"), "omniroll.generated", "omniroll.generated.python"], **kernels)
