"""A picture and settings in, a `Trace` out: one method each, without a verdict. Used by `acceptance`, the service."""
