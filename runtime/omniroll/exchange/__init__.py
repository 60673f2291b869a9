"""Vehicles from and to the files of others: URDF, MJCF; runs beside a simulator of bodies with contacts."""
