"""The page that shows runs moving: what it needs of a run, packed, and the HTML around it.

The page's own sources are in viewer/ of the repository; assets/ holds what `make viewer` builds from them.
"""
