"""Design optimization for RFID self-localization of indoor mobile robots."""

__version__ = "0.1.0"
