"""What pyproject.toml cannot say: packages from several folders, and the kernels that are compiled."""

import runpy

from setuptools import find_packages, setup

BUILD = "runtime/build_kernels.py"
build = runpy.run_path(BUILD)
if build["has_python_headers"]():
    builders = ("double_kernels", "float_kernels", "long_double_kernels", "engine")
    kernels = {"cffi_modules": [f"{BUILD}:{name}" for name in builders]}
else:
    kernels = {"ext_modules": build["shared_libraries"]()}

setup(
    packages=[
        *find_packages("runtime", include=["omniroll*"]),
        "omniroll.codegen",
        "omniroll.csrc",
        "omniroll.generated",
        "omniroll.generated.python",
    ],
    **kernels,
)
