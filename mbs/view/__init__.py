"""What one looks at: pictures, moving pictures, the report page, ParaView, tables. Heavy imports stand in functions."""
