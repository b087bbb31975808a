"""The operator's page and its REST interface: served beside the jobs, which never wait for it."""
