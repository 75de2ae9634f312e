"""What a lab meets when it brings a recording: the check, its pictures, and adding the band."""
