"""Results for other programs: NetCDF, CSV, MATLAB and Octave, ParaView."""

from ploughval.export.export import Format, export_results, formats_of

__all__ = ["Format", "export_results", "formats_of"]
