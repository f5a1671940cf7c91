"""Pages of stress and strain from sections: what the program zdemss draws and writes."""
