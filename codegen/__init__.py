"""From the derivation's data to source text: reads what Maxima derived, writes generated/.

Every formula of the mechanics comes from the data. What codegen adds by itself: the templates of the two files for a
controller hold a Runge-Kutta step and the passing of the contact from one roller to the next, and quadrature.py
computes the tables of Gauss collocation for the compiled engine.

maxima.py       finds or installs Maxima and runs the derivation
cache.py        the folder of what is kept between runs, and the lock under which it is made
derivation.py   the derivation's data, read, checked and canonical
expressions.py  the expression form and its canonical order
programs.py     the functions of a set: steps, scopes, names, where each symbol comes from
scopes.py       names every symbol of a function and finds the loop that it lives in
specialise.py   the programs of a set of effects, from the programs that hold every effect
short_angles.py sines and cosines of angles that stay on a roller, as polynomials
sharing.py      shares subexpressions and hoists them out of loops
operations.py   counts operations
quadrature.py   tables of Gauss collocation
infix.py c.py python.py latex.py   how an expression is printed in each language
pair.py         the header and the source file that a controller takes
engine_sets.py  what the compiled engine must know of a set of effects
formulas.py     the comparison with the paper: records and page
mathtext.py     the paper's LaTeX as plain text and as MathML
filling.py      how templates are filled, and what they use
rendering.py    every emitted file as bytes
on_demand.py    the kernel of one set of effects at run time, without Maxima
what_if.py      what follows from a changed assumption
what_if_kernel.py  the same as a Python kernel, to be simulated
equation.py     LaTeX of one equation
interactive.py  Maxima by hand, with the derivation loaded
__main__.py     `python -m codegen`: writes generated/, or compares with it
"""
