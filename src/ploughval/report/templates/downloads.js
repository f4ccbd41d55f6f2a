// Marks the page as one whose scripts run; what needs them is shown from then on.
document.documentElement.classList.add("scripted");
