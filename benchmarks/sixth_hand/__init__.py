"""Blocks as a sixth hand draws them, who knew of no other: things of any form, material, relief and place, over them or
beside them. A network is taught with them.
"""
