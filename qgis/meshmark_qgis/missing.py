"""What is reported when a program, a driver or a package is not there."""


class Missing(Exception):
    """A program, driver or package is missing; the message explains how to install it."""


class Misnamed(Missing):
    """A path in the settings is wrong: nothing else is used in its place."""
