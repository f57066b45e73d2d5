"""One short script a part, its picture, and its numbers as regression baselines.

`python -m gallery` makes the parts and their pictures; `python -m gallery --check` makes them again, some of them
smaller (see `gallery.entries`), and compares pictures and numbers with `gallery/baselines`.
"""
