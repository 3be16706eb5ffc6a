"""What all pages share, and report.html."""
