"""Errors whose message is meant for the person at the keyboard: one line that says what to do."""


class TensAtlasError(Exception):
    """Base of every error that is the user's to mend; the command line prints it and exits with 2."""


UNEXPECTED_DATA = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)
"""What reading data that is not what it should be may raise."""


class InvalidData(TensAtlasError):
    """A genotype, configuration or file holds something that it must not."""


class UnknownTask(InvalidData):
    """A run, a dump or the user names a task that is neither built in nor in a file that the user named."""


class TaskError(TensAtlasError):
    """A user's task file cannot be read, has an error, or its task returns what it must not."""


class RunFileError(TensAtlasError):
    """A run file is missing, damaged, foreign, newer than this program or in use."""


class DumpError(TensAtlasError):
    """A failure dump is missing, damaged, foreign or newer than this program, or cannot be written."""


class ExportError(TensAtlasError):
    """A solution cannot be exported, or the export cannot be written where it was asked for."""


class ClusterError(TensAtlasError):
    """Workers cannot be started or reached, or are not fit for a run."""
