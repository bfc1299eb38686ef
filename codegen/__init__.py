"""From equations to machine code: text of one step, whole kernel modules, their compilation, and exports."""
