"""Classical controllers, what they are designed with, and their files."""
