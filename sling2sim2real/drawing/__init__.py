"""What the report and the cards of bands are drawn with."""
