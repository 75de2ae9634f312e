"""Recordings and pictures of a band whose truth is known; nothing of the rig."""
