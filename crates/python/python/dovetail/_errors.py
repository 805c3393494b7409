"""Exceptions of the package."""


class Error(Exception):
    """Error with a remedy.

    `message` says what is wrong, `remedy` what to do about it (`None` where nothing is known).
    """

    def __init__(self, message, remedy=None):
        self.message = message
        self.remedy = remedy or None
        super().__init__(message if not remedy else f"{message}\n  {remedy}")

    def __reduce__(self):
        return type(self), (self.message, self.remedy)


class SceneError(Error, ValueError):
    """Scene that is not possible.

    `problems` has all that was found: `(key, message, remedy)`, the key as a dotted path, or `None`
    where it is no single key.
    """

    def __init__(self, message, remedy=None, problems=()):
        self.problems = list(problems)
        super().__init__(message, remedy)

    def __reduce__(self):
        return type(self), (self.message, self.remedy, self.problems)

    @property
    def key(self):
        """Key of the first problem; `None` where it is no single key."""
        return self.problems[0][0] if self.problems else None


class RunError(Error, RuntimeError):
    """Run that ended without a result: a mesh, a reduction, a static state, a lack of memory."""
