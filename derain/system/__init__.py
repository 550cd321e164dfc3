"""The machine: its cores, processes, clocks, libraries, and what is told on its terminal."""
