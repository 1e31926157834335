// Opens the log that this server has beside the page, with the layout that was made for it. Nothing is kept between two
// visits: changes of the layout last as long as the page.
(async () => {
  const ID = "trackably";
  const about = await (await fetch("about.json")).json();
  document.title = about.name;

  localStorage.setItem("studio.profile-data", JSON.stringify({ currentLayoutId: ID }));
  if (!localStorage.getItem("fox.workspace")) {
    // The side bar is closed at first: its icons open it.
    localStorage.setItem("fox.workspace", JSON.stringify({ state: { sidebarItem: null }, version: 0 }));
  }
  const stored = new Map([
    [
      ID,
      {
        id: ID,
        name: about.name,
        permission: "CREATOR_WRITE",
        baseline: { data: about.layout, savedAt: new Date(0).toISOString() },
      },
    ],
  ]);
  const layoutStorage = {
    list: async () => [...stored.values()],
    get: async (_namespace, id) => stored.get(id),
    put: async (_namespace, layout) => (stored.set(layout.id, layout), layout),
    delete: async (_namespace, id) => void stored.delete(id),
    importLayouts: async () => undefined,
  };

  const settings = new Map([
    ["colorScheme", matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"],
    ["updates.enabled", false],
    ["telemetry.telemetryEnabled", false],
    ["telemetry.crashReportingEnabled", false],
    ["hideSignInPrompt", true],
    ["timezone", "UTC"],
    ["time.format", "TOD"],
  ]);
  const appConfiguration = {
    get: (key) => settings.get(key),
    set: async (key, value) => void settings.set(key, value),
    addChangeListener: () => undefined,
    removeChangeListener: () => undefined,
  };

  // The log is fetched as a whole and opened as a local file. A link can name only what is of the kind of remote files.
  const log = new File([await (await fetch("log.mcap")).blob()], "log.mcap");
  const local = new window.McapLocalDataSourceFactory();
  const fetched = new window.RemoteDataSourceFactory();
  fetched.initialize = (args) => local.initialize({ ...args, file: log });
  const link = new URL(location.href);
  link.searchParams.set("ds", fetched.id);
  link.searchParams.set("ds.url", new URL("log.mcap", location.href).href);

  await window.initI18n?.();
  const app = window.React.createElement(window.App, {
    deepLinks: [link.href],
    appConfiguration,
    dataSources: [fetched, local],
    layoutStorage,
    extensionLoaders: [],
    enableGlobalCss: true,
  });
  window.ReactDOM.render(app, document.getElementById("root"));
})();
