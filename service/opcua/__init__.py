"""The daemon's state, recipes and results in; an OPC UA server by OPC 40100-1 (Machine Vision) out. It is served beside
the jobs, which never wait for it. Used by the wiring, and by `commissioning` to check its settings.

`Opc.Ua.MachineVision.NodeSet2.xml.gz` is the OPC Foundation's published file of OPC 40100-1, version 1.0.0, unchanged
but for being packed; its licence (MIT) is its head.
"""
