"""Requests of browsers and programs in; the operator's page, evidence and JSON out. It is served beside the jobs, which
never wait for it. Used by the wiring, and by `commissioning` to check its settings.
"""
