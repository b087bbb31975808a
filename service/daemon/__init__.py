"""Parts in, a process out that keeps them running, answers its control socket and stops in order. Used by `web`,
`wiring` and the commands.
"""
