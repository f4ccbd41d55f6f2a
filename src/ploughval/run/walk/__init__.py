"""The one walk through the photographs: looked at, followed, left and gone on with."""
