"""Files: mechanisms read and written; pictures, the report page, ParaView, tables. Heavy imports stand in functions."""
