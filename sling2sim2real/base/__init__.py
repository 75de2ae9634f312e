"""What every concern stands on: errors, files, schemas, progress, processes, devices."""
