"""The arguments that marking and verification share."""

import numbers

import numpy

from . import _meshmark

# The options of the driver that shape a mark.
OPTIONS = (
    "amplitude",
    "basis",
    "chip_rate",
    "code",
    "part_size",
    "patch_size",
    "precision",
    "shape",
    "tolerance",
)


def check_options(function, options):
    """Raise for an option that shapes no mark."""
    unknown = sorted(set(options) - set(OPTIONS))
    if unknown:
        raise TypeError(
            f"{function}() has no option {unknown[0]}: a mark is shaped by {', '.join(OPTIONS)}, and"
            f" help(meshmark.{function}) lists the other arguments"
        )


def check_kind(name, value, kinds, meant):
    """Raise for an argument that is of none of these kinds; True and False are no numbers."""
    is_bool = isinstance(value, bool) and bool not in kinds
    if is_bool or not isinstance(value, kinds):
        raise TypeError(f"{name} is {value!r}, a {type(value).__name__}, and not {meant}")


def check_switches(switches):
    """Raise for what is neither True nor False."""
    for name, value in switches.items():
        check_kind(name, value, (bool, numpy.bool_), "True or False")


def check_key(key):
    """Raise for what is no key."""
    if not isinstance(key, _meshmark.Key):
        raise TypeError(f"key is a {type(key).__name__}, and not a Key: read a key file with meshmark.Key.read")


def check_run(threads, progress=None):
    """Raise for a number of threads that cannot be, and a progress that cannot be called."""
    check_kind("threads", threads, (numbers.Integral, type(None)), "a whole number")
    if progress is not None and not callable(progress):
        raise TypeError(f"progress is {progress!r}, a {type(progress).__name__}, and not a function")
    if threads is not None and not 1 <= threads <= 256:
        raise ValueError(f"threads={threads} is not a whole number from 1 to 256")


def option_pairs(texts, options):
    """Return the options that are given as the extension takes them: NAME, value."""
    for name, text in texts.items():
        if text is not None and not isinstance(text, str):
            raise TypeError(f"{name} is {text!r}, a {type(text).__name__}, and not a text")
    return [(name.upper(), str(value)) for name, value in {**texts, **options}.items() if value is not None]
