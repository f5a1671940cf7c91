"""Define what every part needs: errors, tables of fields, cells, clock, timers, limits. Imports nothing else of
hpcdem."""
