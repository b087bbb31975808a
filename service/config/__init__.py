"""config.yaml in, checked settings out, or each mistake with its line; reference and JSON schema come from the same
models. It uses no other room of the service, and all may use it.
"""
