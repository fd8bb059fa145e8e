"""Recordings in and files out: the netCDF format, benches of recordings, files written whole or not at all."""
