"""CZI of Zeiss."""
