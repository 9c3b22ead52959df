"""Any number of a mechanism turned: derivatives of readings, fits to data, designs."""
