"""Trajectories to tables: metrics, laws, collisions. No files, no processes, no clock."""
