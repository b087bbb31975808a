"""Words of a command line in, text and an exit status out: a file a command, loaded as its parser is made, so that what
is heavy is imported only when a command runs. Nothing of the service uses it.
"""
