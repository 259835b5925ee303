"""Result of a battery of checks, as of a model or a task."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Findings:
    """Problems and remarks from a battery of checks."""

    name: str  # of what was checked
    # faults that make it unusable, each with a remedy or its place
    problems: tuple[str, ...]
    remarks: tuple[str, ...] = ()  # unusual facts, which may be right

    @property
    def ok(self) -> bool:
        """True where there are no problems."""
        return not self.problems

    def __str__(self) -> str:
        """Verdict, then a line for each problem and remark."""
        problems, remarks = len(self.problems), len(self.remarks)
        verdict = f"problems: {problems or 'none'}, remarks: {remarks or 'none'}"
        if not problems + remarks:
            verdict = "sound"
        lines = [f"{self.name}: {verdict}"]
        lines += [f"  problem: {problem}" for problem in self.problems]
        lines += [f"  remark: {remark}" for remark in self.remarks]
        return "\n".join(lines)
