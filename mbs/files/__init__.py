"""What leaves the house: pictures, the report page, ParaView, tables, scripts. Heavy imports stand in functions."""
