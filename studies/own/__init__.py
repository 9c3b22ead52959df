"""Commands on files of mechanisms: run, sweep, show, statics, sensitivity, fit, optimise, ensemble, explore."""
