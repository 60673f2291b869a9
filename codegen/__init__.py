"""From the derivation's data to source text: reads what Maxima derived, writes generated/. Knows no
mechanics.

maxima.py       finds or installs Maxima and runs the derivation
expressions.py  the expression form and its canonical order
programs.py     a function's steps: scopes, names, where each symbol comes from
sharing.py      shares subexpressions and hoists them out of loops; counts operations
derivation.py   the derivation's data, read, checked and canonical
c.py python.py latex.py   one thin printer a language
formulas.py     the comparison with the paper: records and page
mathtext.py     the paper's LaTeX as plain text and as MathML
rendering.py    the templates: every emitted file as bytes
__main__.py     update or check
what_if.py      what follows from a changed assumption
"""
