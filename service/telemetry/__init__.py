"""The running daemon in; out what a plant's programs read of it: metrics for Prometheus, Sparkplug B for a broker. No
order comes back in. Used by the wiring; `fleet` reads payloads by the same code that writes them.
"""
