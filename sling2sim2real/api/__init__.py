"""What a Python program calls; `import sling2sim2real` has all of it."""
