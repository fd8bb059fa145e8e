"""The one exception that a user's input may raise; the command line turns it into a line and exit code 2."""


class InputError(ValueError):
    """Input that cannot be used: the message is one line naming the file, key or value and what is accepted."""
