// The development server would bundle dependencies ahead of time, and thereby separate the loader from its worker.
export default { base: './', optimizeDeps: { exclude: ['upholster'] }, worker: { format: 'es' } }
