"""The motions of the paper's section 5, run and set beside what the paper says of them.

    omniroll motions out/motions

cases.py says what is run, measures.py what is read off a run, claims.py what the paper says; figures.py,
page.py and writing.py show it. Needs the extra `plots`.
"""
