"""The C of the compiled engine, hand-written; see engine.h. It includes the generated kernels."""
