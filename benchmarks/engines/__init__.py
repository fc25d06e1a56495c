"""What differs between the engines with physics: measures both and writes docs/explanation/engines.md."""
