"""A motion as data: rows of joint angles with their times and targets, its files, and the speed it keeps.

Modules: ``motion``, ``motion_file`` (CSV and npz), ``file_order`` (layers in the order in which a file's motion lays
them), ``given_motion`` (from memory or a file, as it is judged), ``deposition_speed`` (how much of the speed asked for
is kept).
"""
