"""The files that commands write into the folder of ``--out``, and read back.

``outputs`` makes a file or folder appear whole or not at all. ``runs`` holds the files of an identification; the
folders of the other commands have a module each. ``rewriting`` makes any of their reports again.
"""
