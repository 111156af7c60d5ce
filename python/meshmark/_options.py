"""The arguments that marking and verification share."""

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
        raise TypeError(f"{function}() has no option {unknown[0]}: use {', '.join(OPTIONS)}")


def check_threads(threads):
    """Raise for a number of threads that cannot be."""
    if threads is not None and not 1 <= threads <= 256:
        raise ValueError(f"threads={threads} is not a whole number from 1 to 256")


def option_pairs(texts, options):
    """Return the options that are given as the extension takes them: NAME, value."""
    for name, text in texts.items():
        if text is not None and not isinstance(text, str):
            raise TypeError(f"{name} is {text!r}, a {type(text).__name__}, and not a text")
    return [(name.upper(), str(value)) for name, value in {**texts, **options}.items() if value is not None]
