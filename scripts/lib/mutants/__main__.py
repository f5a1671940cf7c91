from mutants.cli import main

main()
